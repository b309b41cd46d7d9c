-- expect: 8: math.floor of an expression: its value is not known while the model is read
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = math.floor(s.t) } end,
}
