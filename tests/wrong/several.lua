-- expect: 10: links[1].mass: value -1, a positive number is needed
-- expect: 11: links[2].centre: unknown field, the nearest known one is "center"
-- expect: 11: links[2].joint[1]: "q" is no joint, x y z phi theta psi are
-- expect: 11: links[2].on: no link "aa", the nearest known one is "a"
-- expect: 13: hold: a number, a list of names such as { "a", "b" } is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = -1 },
    { "b", on = "aa", joint = { "q" }, mass = 1, centre = { 0, 0, 0 } },
  },
  hold = 3,
}
