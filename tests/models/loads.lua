-- Forces of every kind on a slide x and an arm of 1 m that turns about z, at x = 0, psi = 0, xd = 0, psid = 2.
-- By hand, as (Q_x, Q_psi), the arm's tip E at (1, 0, 0) with velocity (0, 2, 0):
--   spring from E to (1, 3, 0), 10 N/m, rest 1 m:  20 N along y at E           (0, 20)
--   damper from E to (1, 3, 0), 5 N s/m:           10 N against y              (0, -10)
--   actuator between E and (4, 0, 0), pushes by 7 N: 7 N against x               (-7, 0)
--   force (1, 2, 3) N at E in the arm's axes:      the same in the ground's    (1, 2)
--   torque (0, 0, 4) N m on the arm:                                           (0, 4)
--   torque (0, 0, 1) N m on the arm, against the cart, which does not turn:    (0, 1)
--   energy 3 y^2 / 2 of E, which is 0 here:                                    (0, 0)
--   friction 0.5 tanh(2 / 0.1) against psi, damper 0.25 N s/m on x:            (0, -0.5)
-- Q = (-6, 16.5), potential energy 20 J.
local rd = require "refdyn"
local on = rd.input("on", 1)                             -- 0: springs and dampers only

return rd.model {
  name = "loads",
  links = {
    { "cart", joint = "x", mass = 2, damper = { x = 0.25 } },
    { "arm", on = "cart", joint = "psi", start_rate = { psi = 2 }, mass = 1, center = { 1, 0, 0 } },
  },
  points = { E = { on = "arm", at = { 1, 0, 0 } } },
  forces = function(s)
    local high = { on = "ground", at = { 1, 3, 0 } }
    return {
      arm_psi = rd.friction(0.5, s.qd.arm_psi, 0.1),
      rd.spring { "E", high, stiffness = 10, rest = 1 },
      rd.damper { "E", high, damping = 5 },
      rd.actuator { from = "E", to = { on = "ground", at = { 4, 0, 0 } }, force = 7 * on },
      { rd.force { "E", { on, 2 * on, 3 * on }, axes = "arm" }, rd.torque { "arm", { 0, 0, 4 * on } } },
      rd.torque { "arm", { 0, 0, on }, against = "cart" },
      rd.energy { 3 * s.points.E.y^2 / 2 },
    }
  end,
}
