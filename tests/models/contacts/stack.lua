local rd = require "refdyn"
local p = rd.parameters { { "e", 0.5 } }
return rd.model {
  name = "stack", gravity = { 0, 0, -9.81 },
  links = { { "lower", joint = "z", mass = 1, start = { z = 0.3 } }, { "upper", joint = "z", mass = 0.7, start = { z = 0.8 } } },
  constraints = function(s) return {
    rd.contact { s.q.lower_z - 0.1, restitution = p.e, name = "ground" },
    rd.contact { s.q.upper_z - s.q.lower_z - 0.2, restitution = p.e, name = "between" } } end,
}
