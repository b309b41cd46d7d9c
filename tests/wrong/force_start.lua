-- expect: 8: forces.a_x: s.start outside a parameter; wrap it in rd.parameter(...)
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = s.start.q.a_x - s.q.a_x } end,
}
