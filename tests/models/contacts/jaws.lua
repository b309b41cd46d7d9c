local rd = require "refdyn"
local p = rd.parameters { { "e", 0.7 }, { "mm", 1000 } }
-- a hinged bar between an upper and a lower stop, gaps in mm, driven back and forth
return rd.model {
  name = "jaws",
  links = { { "bar", joint = "psi", inertia = { zz = 0.2 }, mass = 1 } },
  forces = function(s) return { bar_psi = 3 * rd.cos(2 * s.t) } end,
  constraints = function(s) return {
    rd.contact { p.mm * (0.3 - s.q.bar_psi), restitution = p.e, name = "upper" },
    rd.contact { p.mm * (s.q.bar_psi + 0.2), restitution = p.e, name = "lower" } } end,
}
