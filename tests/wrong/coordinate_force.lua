-- expect: 8: forces.b_x: unknown coordinate; did you mean "a_x"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { b_x = 1 } end,
}
