-- expect: 11: s.axes.b: unknown link; use a
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.position { s.axes.b.x.z },
    }
  end,
}
