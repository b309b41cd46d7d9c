-- expect: 10: links[1].mass: value -1; must be positive
-- expect: 11: links[2].centre: unknown field; did you mean "center"?
-- expect: 11: links[2].joint[1]: "q" is not a joint; use x, y, z, phi, theta or psi
-- expect: 11: links[2].on: no link "aa"; did you mean "a"?
-- expect: 13: hold: a number; must be a list of names such as { "a", "b" }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = -1 },
    { "b", on = "aa", joint = { "q" }, mass = 1, centre = { 0, 0, 0 } },
  },
  hold = 3,
}
