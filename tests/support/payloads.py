"""A payload as the equations without one know it: a last link that has mass and no size."""

from elbow_gym import LinkParameters


def with_speck(arm, payload):
    """The arm with one more link, of the payload's mass and no size, at the hand."""
    speck = LinkParameters(mass=payload, length=1e-12, radius=1e-12)
    return type(arm)(
        links=(*arm.links, speck),
        motors=(*arm.motors, arm.motors[-1]),
        joint_viscous_friction=(*arm.joint_viscous_friction, 0.0),
        nominal_pose=(*arm.nominal_pose, 0.0),
        gravity=arm.gravity,
    )
