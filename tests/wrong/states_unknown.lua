-- expect: 8: states[1].rate: unknown state "curent"; did you mean "current"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  states = function(s)
    return {
      rd.state { "current", rate = -s.states.curent },
      rd.state { "sum", rate = s.qd.a_x },
    }
  end,
}
