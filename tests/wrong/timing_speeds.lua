-- expect: 13: rd.timing.speeds: has 1; must have 2 to 60
-- expect: 14: rd.timing.speeds[2]: value -1; must not be negative
-- expect: 15: rd.timing.speeds[2]: depends on the motion; must be a number or an expression in parameters
-- expect: 16: rd.timing.speeds: has named entries (first); must be a list of numbers such as { 0, 1, 0 }
-- expect: 17: rd.timing.speeds[3]: 0 as the one before it; one of them must be positive
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" }, { "z", 0.4, "1" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 } } },
  courses = function(s)
    return {
      a = rd.timing { s.t, length = 1, speeds = { 1 } }.way,
      b = rd.timing { s.t, length = 1, speeds = { 0, -1, 0 } }.way,
      c = rd.timing { s.t, length = 1, speeds = { 0, s.q.a_x, 0 } }.way,
      d = rd.timing { s.t, length = 1, speeds = { first = 0 } }.way,
      e = rd.timing { s.t, length = 1, speeds = { 1, 0, 0, 1 } }.way,
    }
  end,
}
