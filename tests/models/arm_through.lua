-- Two bars on a cart. Seen from the cart, their tip is at the distance d(t) and the angle w(t) that an elbow at the
-- angle e(t) yields. The motion with lower_psi = e is smooth also where the arm is stretched (e = 0) or folded (e = pi), and
-- the rows have rank 1. `rows` = angles prescribes the same motion by rows that never lose rank. `hang` hangs a
-- flexible rod from the cart, which adds stiff modes.
local rd = require "refdyn"
local rows = rd.option("rows", "tip", { "tip", "angles" })
local hang = rd.option("hang", false)
local p = rd.parameters { { "rate", -1, "rad/s" }, { "miss", 0, "m" } }
local a, b = 1, 0.7
local elbow, turn, swing = 0.9, 0.3, 0.1                   -- e, w and the amplitude of e's swing at the start
local reached = a^2 + b^2 + 2 * a * b * rd.cos(elbow)
local elbow_rate = p.rate + 2 * swing
local upper = { turn - rd.atan2(b * rd.sin(elbow), a + b * rd.cos(elbow)),
                0.4 - (b^2 + a * b * rd.cos(elbow)) / reached * elbow_rate }
local function bar(l, m) return { rd.box { { l, 0.02, 0.02 }, mass = m, at = { l / 2, 0, 0 } } } end
local links = {
  { "cart", joint = "x", mass = 3, spring = { x = 40 }, damper = { x = 0.7 } },
  { "upper", on = "cart", at = { 0, 0.1, 0 }, joint = "psi", start = { psi = upper[1] }, start_rate = { psi = upper[2] },
    bodies = bar(a, 1.3) },
  { "lower", on = "upper", at = { a, 0, 0 }, joint = "psi", start = { psi = elbow }, start_rate = { psi = elbow_rate },
    bodies = bar(b, 0.8) },
}
if hang then
  links[4] = { "rod", on = "cart", turn = { { "z", -rd.pi / 2 } }, joint = "psi",
    beam = { length = 0.6, section = rd.round(0.01), E = 2.1e11, nu = 0.3, rho = 7800, eta = 1e-4, rfe = 5, dofs = "psi" } }
end
return rd.model {
  name = "arm_through", gravity = { 0, -9.81, 0 }, links = links,
  points = { tip = { on = "lower", at = { b, 0, 0 } } },
  constraints = function(state)
    local t, tip, q = state.t, state.points.tip, state.q
    local e, w = elbow + p.rate * t + swing * rd.sin(2 * t), turn + 0.4 * t
    if rows == "angles" then
      return { rd.position { q.upper_psi + rd.atan2(b * rd.sin(e), a + b * rd.cos(e)) - w, name = "along" },
               rd.position { q.lower_psi - e, name = "across" } }
    end
    local d = rd.sqrt(a^2 + b^2 + 2 * a * b * rd.cos(e)) + p.miss
    return { rd.position { tip.x - q.cart_x - d * rd.cos(w), name = "along", alpha = 20, beta = 20 },
             rd.position { tip.y - 0.1 - d * rd.sin(w), name = "across", alpha = 20, beta = 20 } }
  end,
}
