-- Two bars in a plane with dry joints, each driven by an oscillating torque.
local rd = require "refdyn"
local p = rd.parameters { { "w", 1e-6, "rad/s" } }

return rd.model {
  name = "friction_arm", gravity = { 0, -9.81, 0 },
  links = {
    { "upper", turn = { { "z", -rd.pi / 2 } }, joint = "psi", mass = 1.5, center = { 0.4, 0, 0 } },
    { "lower", on = "upper", at = { 0.4, 0, 0 }, joint = "psi", mass = 0.8, center = { 0.3, 0, 0 } },
  },
  forces = function(s)
    return {
      upper_psi = 4 * rd.sin(2 * s.t) + rd.friction(1.5, s.qd.upper_psi, p.w),
      lower_psi = rd.sin(5 * s.t) + rd.friction(0.7, s.qd.lower_psi, p.w),
    }
  end,
}
