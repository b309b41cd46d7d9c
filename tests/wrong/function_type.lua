-- expect: 8: rd.sin: argument 1 is a group of values; must be a number or an expression, as in rd.sin(a)
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = rd.sin(s.q) } end,
}
