-- expect: 9: gravty: unknown field; did you mean "gravity"?
-- expect: 10: zzzzzzzz: unknown field; use one of name, gravity, length, links, points, forces, states, courses, limits, constraints, events, drives, dependent, hold, form
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  gravty = { 0, 0, -9.81 },
  zzzzzzzz = 1,
}
