-- expect: 8: s.time: unknown field; use one of t, q, qd, qdd, points, inputs, start, axes, states
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = s.time } end,
}
