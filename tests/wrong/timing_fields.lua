-- expect: 13: rd.timing.acceleration: missing; a law by rate needs it
-- expect: 14: rd.timing.length: missing; a law by rate needs it
-- expect: 15: rd.timing.jerk: has no effect without rate; add rate
-- expect: 16: rd.timing.rat: unknown field; did you mean "rate"?
-- expect: 17: rd.timing.length: value -1; must be positive
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" }, { "z", 0.4, "1" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 } } },
  courses = function(s)
    return {
      a = rd.timing { s.t, length = 1, rate = p.v }.way,
      b = rd.timing { s.t, rate = p.v, acceleration = 1 }.way,
      c = rd.timing { s.t, length = 1, speeds = { 0, 1, 0 }, jerk = 3 }.way,
      d = rd.timing { s.t, length = 1, rat = 1, acceleration = 1 }.way,
      e = rd.timing { s.t, length = -1, rate = 1, acceleration = 1 }.way,
    }
  end,
}
