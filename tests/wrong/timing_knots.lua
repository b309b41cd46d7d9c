-- expect: 14: rd.timing.knots: has 1; must have 2 to 60
-- expect: 15: rd.timing.knots[1]: at 0.1; times must begin with 0 and ascend
-- expect: 16: rd.timing.knots[3]: at 1; times must begin with 0 and ascend
-- expect: 17: rd.timing.knots[2]: must be { time, way }, a plain number and an expression in parameters
-- expect: 18: rd.timing.knots[2]: must be { time, way }, a plain number and an expression in parameters
-- expect: 19: rd.timing.degree: value 4; must be 3 or 5
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" }, { "z", 0.4, "1" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 } } },
  courses = function(s)
    return {
      a = rd.timing { s.t, knots = { { 0, 0 } } }.way,
      b = rd.timing { s.t, knots = { { 0.1, 0 }, { 1, 1 } } }.way,
      c = rd.timing { s.t, knots = { { 0, 0 }, { 1, 1 }, { 1, 2 } } }.way,
      d = rd.timing { s.t, knots = { { 0, 0 }, { p.v, 1 } } }.way,
      f = rd.timing { s.t, knots = { { 0, 0 }, { 1, s.q.a_x } } }.way,
      e = rd.timing { s.t, knots = { { 0, 0 }, { 1, 1 } }, degree = 4 }.way,
    }
  end,
}
