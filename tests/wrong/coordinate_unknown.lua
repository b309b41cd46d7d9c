-- expect: 8: s.q.a_y: unknown coordinate; did you mean "a_x"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = s.q.a_y } end,
}
