-- expect: 9: forces: a table; must be a function
-- expect: 10: constraints: a number; must be a function
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  forces = { a_x = 1 },
  constraints = 3,
}
