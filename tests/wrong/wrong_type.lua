-- expect: 8: links[1].mass: a text, a number or an expression of parameters is needed
-- expect: 8: links[1].center: a number, a list of 3 numbers such as { 0, 0, 1 } is needed
-- expect: 10: forces: a table, a function is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = "heavy", center = 3 },
  },
  forces = { a_x = 1 },
}
