-- expect: 8: math.sin of an expression: use rd.sin
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = math.sin(s.t) } end,
}
