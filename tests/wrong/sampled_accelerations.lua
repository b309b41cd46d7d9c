-- expect: 10: events[1].inputs.u: depends on accelerations; a value set by an event may depend on t, q, qd and inputs only
local rd = require "refdyn"
local u = rd.input("u", 0, "N")
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  forces = function(s) return { a_x = u } end,
  events = function(s)
    return {
      rd.sampled { every = 1, inputs = { u = s.qdd.a_x } },
    }
  end,
}
