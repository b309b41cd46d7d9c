-- expect: 10: rd.timing: has none of rate, speeds and knots; give one
-- expect: 11: rd.timing: has several of rate, speeds and knots; give one
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" }, { "z", 0.4, "1" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 } } },
  courses = function(s)
    return {
      none = rd.timing { s.t, length = 1 }.way,
      two = rd.timing { s.t, length = 1, rate = 1, acceleration = 1, speeds = { 0, 1, 0 } }.way,
    }
  end,
}
