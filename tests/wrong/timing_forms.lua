-- expect: 13: rd.timing: has none of rate, speeds, knots and control; give one
-- expect: 14: rd.timing: has several of rate, speeds, knots and control; give one
-- expect: 15: rd.timing.duration: missing; a law by control needs it
-- expect: 16: rd.timing.control: has 1; must have 2 to 60
-- expect: 17: rd.timing.duration: has no effect without knots or control; remove it
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" }, { "z", 0.4, "1" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 } } },
  courses = function(s)
    return {
      none = rd.timing { s.t, length = 1 }.way,
      two = rd.timing { s.t, length = 1, rate = 1, acceleration = 1, speeds = { 0, 1, 0 } }.way,
      long = rd.timing { s.t, control = { 0, 1 } }.way,
      short = rd.timing { s.t, control = { 0 }, duration = 1 }.way,
      vain = rd.timing { s.t, length = 1, speeds = { 0, 1, 0 }, duration = 1 }.way,
    }
  end,
}
