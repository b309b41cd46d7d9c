-- expect: 10: forces.z: unknown coordinate; use a_x
-- expect: 12: events[1].rates.z: unknown coordinate; use a_x
-- expect: 12: events[1].states.a_x: unknown state; use z
-- expect: 12: events[1].states.v: unknown state; use z
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  states = function(s) return { rd.state { "z", rate = 1 } } end,
  forces = function(s) return { z = 1 } end,
  events = function(s)
    return { rd.event { s.t - 1, states = { v = 0, a_x = 1 }, rates = { z = 1 } } }
  end,
  hold = { "zz" },
}
