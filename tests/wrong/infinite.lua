-- expect: 11: constraints[1]: contains inf; all numbers must be finite
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.position { s.q.a_x / 0 },
    }
  end,
}
