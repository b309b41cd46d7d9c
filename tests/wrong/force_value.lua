-- expect: 8: forces.a_x: a text; must be a number or an expression
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = "large" } end,
}
