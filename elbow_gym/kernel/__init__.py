"""Compiled core: an O(n) articulated-body recursion, Runge-Kutta steps and energy meters for blocks of arms.

Coordinates are the yaw psi = q_1 and the absolute pitches phi_a of links a = 2..n, with w_a = phi_a_dot and
alpha_a = phi_a_ddot. All links pitch about parallel axes, so that they move in one vertical plane, (rho, z), which
turns with the yaw. In it link a has the direction e = (sin phi, cos phi) and the lever e' = l (cos phi, -sin phi).
Motors sit between links: their torque u = K_m i - (D + D_m) q_dot and their rotors' inertia J act on the relative
angle q_a = phi_a - phi_(a-1).

Yaw. It is coupled to the pitches by velocities alone, so its acceleration is found apart:

    (I_psi + J_1) psi_ddot = u_1 - I_psi_dot psi_dot,    I_psi = I_s1 + sum of m rho_c^2 + I_t sin^2 phi + I_s cos^2 phi

with rho_c the radius of a link's centre of mass. Outward, I_psi and its rate are summed together with positions.

Pitches. The rest of the arm beyond a joint answers the parent's motion (A_rho, A_z, alpha_parent) by a linear law:
the force and torque it takes are K (A, alpha) + b, with a symmetric 3x3 matrix K and a vector b. K and b of the payload
start the recursion. For a link let c = -l e w^2 be the acceleration of its end by its own turning and h = b + K (c, 0).
With forces f and torque 3 as indices, g = K_ff e' + K_f3, and the inertias of a rod about its joint,

    I_f3 = m e'/2 + g                        I_33 = I_t + m l^2/4 + e' (g + K_f3) + K_33
    p_f = m c/2 + m (-rho_c psi_dot^2, g_0) + h_f
    p_3 = e'/2 m (-rho_c psi_dot^2, g_0) - (I_t - I_s) sin phi cos phi psi_dot^2 + e' h_f + h_3

(g_0: gravity). The joint's own equation is (I_33 + J) alpha = u - p_3 + J alpha_parent - I_f3 A. Solved for alpha and
put back, it leaves a law of the same form for the parent: with d = 1 / (I_33 + J) and r = u - p_3,

    K_ff <- m 1 + K_ff - d I_f3 I_f3^T       K_f3 <- d J I_f3       K_33 <- J - J^2 d
    b_f  <- p_f + d r I_f3                   b_3  <- u - J d r

Inward, this runs from tip to base. From the base, where nothing accelerates, the joints' equations then give alpha and
A link by link. In the code the terms of c are part of the accelerations SUMR and SUMZ that the outward pass sums, so
that h is not formed.

Elbows. A unit force along +z at an elbow is the recursion with b = (0, -1, 0) there and no other bias: y is its r. As
the recursion is linear in r, the elbows' vertical accelerations for unit forces are W_ij = sum of d y_i y_j over the
links before both, and without forces they are the sum of d y r plus that of the pitch rates alone. The forces
f = -W^-1 z_ddot_free hold the elbows; they add sum of y f to r. What else acts at a link's end, a compliant table or
friction, enters b there, and its tangential part turns the yaw.

A run: `block` gathers arms into lanes; per step `integration` evaluates four times (`recursion`, `elbows`, with
`elbow_friction` and `contact` where switched on), takes the stages' sum (`rk4_joint`) and projects onto the elbows'
plane (`projection`); `block` scatters the lanes. `slots` says where each quantity is kept; the "Reads" and "Writes" of
each pass name them, and a test compares both with the code. `template` and `build` compile a kernel for a lane count
and a set of switches, `control` and `entries` are what Python calls. `observe` turns states into observations and
rewards; `path` has the points of the target's path.

One flat array, constant slot offsets and straight bodies under `for k in range(LANES)` let LLVM prove that rows do not
overlap, and vectorise. Strict floating point and a sine of its own (`sine`) keep every lane's bits the same for any
number of lanes.
"""
