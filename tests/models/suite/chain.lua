-- Two bars on hinges with point masses at their ends: the upper mass is 1 kg, the lower one `ratio` times that.
local rd = require "refdyn"
local p = rd.parameters { { "ratio", 1, "1" }, { "L", 0.5, "m" }, { "upper", 0.8, "rad" }, { "lower", -0.3, "rad" } }

return rd.model {
  name = "suite_chain", gravity = { 0, -9.81, 0 },
  links = {
    { "upper", turn = { { "z", -rd.pi / 2 } }, joint = "psi", start = { psi = p.upper }, mass = 1, center = { p.L, 0, 0 } },
    { "lower", on = "upper", at = { p.L, 0, 0 }, joint = "psi", start = { psi = p.lower }, mass = p.ratio,
      center = { p.L, 0, 0 } },
  },
  points = { E = { on = "lower", at = { p.L, 0, 0 } } },
}
