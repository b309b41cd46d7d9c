-- expect: 13: constraints[1].coordinate: unknown coordinate "a_y"; did you mean "a_x"?
-- expect: 14: constraints[2].value: missing; rd.drive needs it
-- expect: 15: constraints[3].coordinate: unknown coordinate "b_x"; did you mean "a_x"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.drive { "a_y", 1 },
      rd.drive { "a_x" },
      rd.lock { "b_x" },
    }
  end,
}
