"""An arm of the family as a MuJoCo model."""


def mjcf(arm, table=False):
    """Nested bodies with z along the link; armature is the reflected rotor inertia, damping all viscous friction.

    With a table, points (spheres of next to no radius) at joints 3..n and the hand touch a plane without friction.
    """
    bodies = ""
    point = '<geom size="1e-9" mass="0" condim="1" solref="-1e5 -200" contype="1" conaffinity="0" pos="0 0 {!r}"/>'
    for k, (link, motor) in enumerate(zip(arm.links, arm.motors, strict=True)):
        base = arm.links[k - 1].length if k else 0.0
        # Link 1 only yaws, so its inertia across is free; MuJoCo wants it safely above half of the one along.
        across = link.transverse_inertia * (1.0 if k else 2.0)
        damping = arm.joint_viscous_friction[k] + motor.reflected_viscous_friction
        bodies += f"""
            <body pos="0 0 {base!r}">
              <joint axis="{"0 1 0" if k else "0 0 1"}" armature="{motor.reflected_inertia!r}" damping="{damping!r}"/>
              <inertial pos="0 0 {link.length / 2.0!r}" mass="{link.mass!r}" diaginertia="
                {across!r} {across!r} {link.axial_inertia!r}"/>
              {point.format(link.length) if table and k else ""}"""
    return f"""
        <mujoco>
          <compiler angle="radian" boundmass="0" boundinertia="0"/>
          <option gravity="0 0 {-arm.gravity!r}"/>
          <worldbody>
            {'<geom type="plane" size="9 9 1" contype="0" conaffinity="1" condim="1"/>' if table else ""}
            {bodies}{"</body>" * arm.n_joints}</worldbody>
        </mujoco>"""
