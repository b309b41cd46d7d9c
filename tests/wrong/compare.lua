-- expect: 9: comparison of an expression: its value is not known while the model is read; use rd.where(rd.less(a, b), x, y) to choose during the motion
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s)
    if s.t < 2 then return { a_x = 1 } end
  end,
}
