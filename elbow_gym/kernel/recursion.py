"""The articulated-body recursion: outward for velocities and forces, inward for inertia and bias."""

# pyright: basic

from elbow_gym.kernel.contact import gear_friction, table_contact
from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.slots import (
    AXIAL, B3, BR, BUS, BZ, CONTACT_N, CONTACT_R, CURRENT, D, DAMPING, DIFFERENCE, DRIVE, END_INERTIA, ER, EZ, FR, FZ,
    GRAVITY, IR3, IZ3, KM, KRR, KRZ, KZZ, LANES, LENGTH, LOWEST_Z, MASS, NEXT, OMEGA, PAYLOAD, PHI, Q, Q_DOT, R, RHO,
    RHO_DOT, ROTOR, SPIN, STRIDE, SUMR, SUMZ, TABLE, TORQUE_BIAS, U, VOLTAGE, YAW_INERTIA, YAW_INERTIA_RATE, Z, Z_DOT,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template
def outward(ws, n):
    """Positions, velocity products, yaw inertia and each link's inertial and gravity force, base to tip.

    Reads: Q, Q_DOT, CURRENT, VOLTAGE, LENGTH, MASS, DIFFERENCE, AXIAL, GRAVITY, PHI, OMEGA, SPIN, RHO, RHO_DOT, SUMR,
        SUMZ, Z, YAW_INERTIA, YAW_INERTIA_RATE, LOWEST_Z, Z_DOT, BUS.
    Writes: PHI, OMEGA, SPIN, RHO, RHO_DOT, SUMR, SUMZ, Z, YAW_INERTIA, YAW_INERTIA_RATE, LOWEST_Z, ER, EZ, FR, FZ,
        TORQUE_BIAS, BUS.
    """
    if DRIVE:
        for k in range(LANES):
            ws[BUS + k] = ws[VOLTAGE + k] * ws[CURRENT + k]
    for a in range(1, n):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            parent = here - NEXT
            phi = ws[parent + PHI] + ws[here + Q]
            w = ws[parent + OMEGA] + ws[here + Q_DOT]
            s, c = sincos(phi)
            m = ws[here + MASS]
            half = 0.5 * ws[here + LENGTH]
            difference = ws[here + DIFFERENCE]
            spin = ws[parent + SPIN]
            hs = half * s
            hc = half * c
            ww = w * w
            rho = ws[parent + RHO] + hs
            rhod = ws[parent + RHO_DOT] + hc * w
            sumr = ws[parent + SUMR] - hs * ww
            sumz = ws[parent + SUMZ] - hc * ww
            z = ws[parent + Z] + 2.0 * hc
            fr = m * (sumr - rho * spin)
            fz = m * (sumz + ws[here + GRAVITY])
            dsc = difference * s * c
            ws[here + PHI] = phi
            ws[here + OMEGA] = w
            ws[here + SPIN] = spin
            ws[here + RHO] = rho + hs
            ws[here + RHO_DOT] = rhod + hc * w
            ws[here + SUMR] = sumr - hs * ww
            ws[here + SUMZ] = sumz - hc * ww
            ws[here + Z] = z
            ws[here + LOWEST_Z] = min(ws[parent + LOWEST_Z], z)
            ws[here + YAW_INERTIA] = ws[parent + YAW_INERTIA] + (
                m * rho * rho + (difference * s * s + ws[here + AXIAL])
            )
            ws[here + YAW_INERTIA_RATE] = ws[parent + YAW_INERTIA_RATE] + 2.0 * (m * rho * rhod + dsc * w)
            ws[here + ER] = 2.0 * hc
            ws[here + EZ] = -2.0 * hs
            ws[here + FR] = fr
            ws[here + FZ] = fz
            ws[here + TORQUE_BIAS] = hc * fr - hs * fz - dsc * spin
            if TABLE:
                table_contact(ws, here, rho + hs, rhod + hc * w, z, ws[parent + Z_DOT] - 2.0 * hs * w)
            if DRIVE:
                ws[here + BUS] = ws[parent + BUS] + ws[here + VOLTAGE] * ws[here + CURRENT]


@template
def inward(ws, n):
    """Articulated inertia K and bias b, tip to base; starts from the payload at the tip.

    Reads: Q_DOT, CURRENT, MASS, END_INERTIA, ROTOR, KM, DAMPING, GRAVITY, PAYLOAD, SPIN, RHO, SUMR, SUMZ, ER, EZ, FR,
        FZ, TORQUE_BIAS, D, KRR, KRZ, KZZ, BR, BZ, B3, CONTACT_R, CONTACT_N, IR3, IZ3.
    Writes: D, KRR, KRZ, KZZ, BR, BZ, B3, IR3, IZ3, R.
    """
    record = U(n * STRIDE)
    for k in range(LANES):
        here = record + k
        parent = here - NEXT
        payload = ws[parent + PAYLOAD]
        ws[here + KRR] = payload
        ws[here + KRZ] = 0.0
        ws[here + KZZ] = payload
        ws[here + IR3] = 0.0
        ws[here + IZ3] = 0.0
        ws[here + D] = 0.0
        ws[here + BR] = payload * (ws[parent + SUMR] - ws[parent + RHO] * ws[parent + SPIN])
        ws[here + BZ] = payload * (ws[parent + SUMZ] + ws[parent + GRAVITY])
        ws[here + B3] = 0.0
    for a in range(n - 1, 0, -1):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            child = here + NEXT
            er = ws[here + ER]
            ez = ws[here + EZ]
            m = ws[here + MASS]
            j = ws[here + ROTOR]
            krr = ws[child + KRR]
            krz = ws[child + KRZ]
            kzz = ws[child + KZZ]
            # The rest's rotational inertia, out of what the joint after this one keeps anyway: stores cost most here.
            jd = ws[child + ROTOR] * ws[child + D]
            kr3 = jd * ws[child + IR3]
            kz3 = jd * ws[child + IZ3]
            k33 = ws[child + ROTOR] - ws[child + ROTOR] * jd
            br = ws[child + BR]
            bz = ws[child + BZ]
            if TABLE:
                br -= ws[here + CONTACT_R]
                bz -= ws[here + CONTACT_N]
            gr = krr * er + krz * ez + kr3
            gz = krz * er + kzz * ez + kz3
            ir3 = 0.5 * m * er + gr
            iz3 = 0.5 * m * ez + gz
            i33 = (ws[here + END_INERTIA] + k33) + (er * (gr + kr3) + ez * (gz + kz3))
            u = ws[here + KM] * ws[here + CURRENT] - ws[here + DAMPING] * ws[here + Q_DOT]
            if DRIVE:
                u -= gear_friction(ws, here)
            r = (u - ws[here + TORQUE_BIAS] - ws[child + B3]) - (er * br + ez * bz)
            d = 1.0 / (i33 + j)
            dr = d * r
            ws[here + KRR] = m + krr - d * ir3 * ir3
            ws[here + KRZ] = krz - d * ir3 * iz3
            ws[here + KZZ] = m + kzz - d * iz3 * iz3
            ws[here + BR] = ws[here + FR] + br + dr * ir3
            ws[here + BZ] = ws[here + FZ] + bz + dr * iz3
            ws[here + B3] = u - j * dr
            ws[here + IR3] = ir3
            ws[here + IZ3] = iz3
            ws[here + R] = r
            ws[here + D] = d
