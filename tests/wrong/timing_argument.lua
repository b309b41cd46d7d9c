-- expect: 9: rd.timing: argument 1 is an expression; must be a table, as in rd.timing { s.t, length = 1, rate = 0.5, acceleration = 2 }
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" }, { "z", 0.4, "1" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 } } },
  courses = function(s)
    return {
      a = rd.timing(s.t).way,
    }
  end,
}
