-- expect: 8: rd.atan2: 1 argument; must have 2, as in rd.atan2(a, b)
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = rd.atan2(s.t) } end,
}
