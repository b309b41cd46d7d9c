-- expect: 7: s.states.zz: unknown state; did you mean "z"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  states = function(s) return { rd.state { "z", rate = 1 } } end,
  forces = function(s) return { z = 1, a_x = s.states.zz + s.q.z } end,
}
