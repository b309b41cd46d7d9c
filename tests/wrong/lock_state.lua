-- expect: 11: constraints[1].value: depends on the motion; must be a number or an expression in parameters
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.lock { "a_x", s.q.a_psi },
    }
  end,
}
