-- expect: 8: rd.rate: the argument depends on the state or on inputs; must be a course in time
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 } } },
  courses = function(s)
    return {
      a = rd.rate(s.t * s.q.a_x),
    }
  end,
}
