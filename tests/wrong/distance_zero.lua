-- expect: 11: constraints[1].length: value 0; must be positive (to make points coincide use rd.loop)
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.distance { "E", "ground", 0 },
    }
  end,
}
