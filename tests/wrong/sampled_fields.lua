-- expect: 18: events[1].every: value 0; must be positive
-- expect: 19: events[2].every: value 1e-12; must be at least 1e-06
-- expect: 20: events[3].every: value -1; must be positive
-- expect: 21: events[4].every: missing; rd.sampled needs it
-- expect: 22: events[5].every: a text; must be a number or an expression in parameters
-- expect: 23: events[6]: sets nothing; add inputs or parameters
-- expect: 24: events[7].inputs.v: unknown input; use u
-- expect: 25: events[8].rates: unknown field; use one of every, inputs, parameters, name
-- expect: 25: events[8]: sets nothing; add inputs or parameters
local rd = require "refdyn"
local u = rd.input("u", 0, "N")
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  forces = function(s) return { a_x = u } end,
  events = function(s)
    return {
      rd.sampled { every = 0, inputs = { u = 1 } },
      rd.sampled { every = 1e-12, inputs = { u = 1 } },
      rd.sampled { every = -1, inputs = { u = 1 } },
      rd.sampled { inputs = { u = 1 } },
      rd.sampled { every = "1", inputs = { u = 1 } },
      rd.sampled { every = 1 },
      rd.sampled { every = 1, inputs = { v = 1 } },
      rd.sampled { every = 1, rates = { a_x = 1 } },
    }
  end,
}
