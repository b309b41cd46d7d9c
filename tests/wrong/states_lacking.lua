-- expect: 6: s.states.z: unknown state; there are none
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  forces = function(s) return { a_x = s.states.z } end,
}
