-- expect: 8: links[1].mass: a text; must be a number or an expression in parameters
-- expect: 8: links[1].center: a number; must be a list of 3 numbers such as { 0, 0, 1 }
-- expect: 10: forces: a table; must be a function
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = "heavy", center = 3 },
  },
  forces = { a_x = 1 },
}
