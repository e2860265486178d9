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
        here = U(a * STRIDE)
        parent = here - NEXT
        for k in range(LANES):
            phi = ws[parent + PHI + k] + ws[here + Q + k]
            w = ws[parent + OMEGA + k] + ws[here + Q_DOT + k]
            s, c = sincos(phi)
            m = ws[here + MASS + k]
            half = 0.5 * ws[here + LENGTH + k]
            difference = ws[here + DIFFERENCE + k]
            spin = ws[parent + SPIN + k]
            hs = half * s
            hc = half * c
            ww = w * w
            rho = ws[parent + RHO + k] + hs
            rhod = ws[parent + RHO_DOT + k] + hc * w
            sumr = ws[parent + SUMR + k] - hs * ww
            sumz = ws[parent + SUMZ + k] - hc * ww
            z = ws[parent + Z + k] + 2.0 * hc
            fr = m * (sumr - rho * spin)
            fz = m * (sumz + ws[here + GRAVITY + k])
            dsc = difference * s * c
            ws[here + PHI + k] = phi
            ws[here + OMEGA + k] = w
            ws[here + SPIN + k] = spin
            ws[here + RHO + k] = rho + hs
            ws[here + RHO_DOT + k] = rhod + hc * w
            ws[here + SUMR + k] = sumr - hs * ww
            ws[here + SUMZ + k] = sumz - hc * ww
            ws[here + Z + k] = z
            ws[here + LOWEST_Z + k] = min(ws[parent + LOWEST_Z + k], z)
            ws[here + YAW_INERTIA + k] = ws[parent + YAW_INERTIA + k] + (
                m * rho * rho + (difference * s * s + ws[here + AXIAL + k])
            )
            ws[here + YAW_INERTIA_RATE + k] = ws[parent + YAW_INERTIA_RATE + k] + 2.0 * (m * rho * rhod + dsc * w)
            ws[here + ER + k] = 2.0 * hc
            ws[here + EZ + k] = -2.0 * hs
            ws[here + FR + k] = fr
            ws[here + FZ + k] = fz
            ws[here + TORQUE_BIAS + k] = hc * fr - hs * fz - dsc * spin
            if TABLE:
                table_contact(ws, here, k, rho + hs, rhod + hc * w, z, ws[parent + Z_DOT + k] - 2.0 * hs * w)
            if DRIVE:
                ws[here + BUS + k] = ws[parent + BUS + k] + ws[here + VOLTAGE + k] * ws[here + CURRENT + k]


@template
def inward(ws, n):
    """Articulated inertia K and bias b, tip to base; starts from the payload at the tip.

    Reads: Q_DOT, CURRENT, MASS, END_INERTIA, ROTOR, KM, DAMPING, GRAVITY, PAYLOAD, SPIN, RHO, SUMR, SUMZ, ER, EZ, FR,
        FZ, TORQUE_BIAS, D, KRR, KRZ, KZZ, BR, BZ, B3, CONTACT_R, CONTACT_N, IR3, IZ3.
    Writes: D, KRR, KRZ, KZZ, BR, BZ, B3, IR3, IZ3, R.
    """
    here = U(n * STRIDE)
    parent = here - NEXT
    for k in range(LANES):
        payload = ws[parent + PAYLOAD + k]
        ws[here + KRR + k] = payload
        ws[here + KRZ + k] = 0.0
        ws[here + KZZ + k] = payload
        ws[here + IR3 + k] = 0.0
        ws[here + IZ3 + k] = 0.0
        ws[here + D + k] = 0.0
        ws[here + BR + k] = payload * (ws[parent + SUMR + k] - ws[parent + RHO + k] * ws[parent + SPIN + k])
        ws[here + BZ + k] = payload * (ws[parent + SUMZ + k] + ws[parent + GRAVITY + k])
        ws[here + B3 + k] = 0.0
    for a in range(n - 1, 0, -1):
        here = U(a * STRIDE)
        child = here + NEXT
        for k in range(LANES):
            er = ws[here + ER + k]
            ez = ws[here + EZ + k]
            m = ws[here + MASS + k]
            j = ws[here + ROTOR + k]
            krr = ws[child + KRR + k]
            krz = ws[child + KRZ + k]
            kzz = ws[child + KZZ + k]
            # The rest's rotational inertia, out of what the joint after this one keeps anyway: stores cost most here.
            jd = ws[child + ROTOR + k] * ws[child + D + k]
            kr3 = jd * ws[child + IR3 + k]
            kz3 = jd * ws[child + IZ3 + k]
            k33 = ws[child + ROTOR + k] - ws[child + ROTOR + k] * jd
            br = ws[child + BR + k]
            bz = ws[child + BZ + k]
            if TABLE:
                br -= ws[here + CONTACT_R + k]
                bz -= ws[here + CONTACT_N + k]
            gr = krr * er + krz * ez + kr3
            gz = krz * er + kzz * ez + kz3
            ir3 = 0.5 * m * er + gr
            iz3 = 0.5 * m * ez + gz
            i33 = (ws[here + END_INERTIA + k] + k33) + (er * (gr + kr3) + ez * (gz + kz3))
            u = ws[here + KM + k] * ws[here + CURRENT + k] - ws[here + DAMPING + k] * ws[here + Q_DOT + k]
            if DRIVE:
                u -= gear_friction(ws, here, k)
            r = (u - ws[here + TORQUE_BIAS + k] - ws[child + B3 + k]) - (er * br + ez * bz)
            d = 1.0 / (i33 + j)
            dr = d * r
            ws[here + KRR + k] = m + krr - d * ir3 * ir3
            ws[here + KRZ + k] = krz - d * ir3 * iz3
            ws[here + KZZ + k] = m + kzz - d * iz3 * iz3
            ws[here + BR + k] = ws[here + FR + k] + br + dr * ir3
            ws[here + BZ + k] = ws[here + FZ + k] + bz + dr * iz3
            ws[here + B3 + k] = u - j * dr
            ws[here + IR3 + k] = ir3
            ws[here + IZ3 + k] = iz3
            ws[here + R + k] = r
            ws[here + D + k] = d
