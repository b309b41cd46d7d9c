-- expect: 19: states[1].name: missing; rd.state needs it
-- expect: 20: states[2].rate: missing; rd.state needs it
-- expect: 21: states[3].rate: a text; must be a number or an expression
-- expect: 22: states[4].start: a text; must be a number or an expression in parameters
-- expect: 23: states[5].begin: unknown field; use one of name, rate, start, unit, scale
-- expect: 24: states[6].scale: value 0; must be positive
-- expect: 25: states[7].start: depends on the motion; must be a number or an expression in parameters
-- expect: 26: states[8].name: "n" is already taken in line 25; choose another name
-- expect: 27: states[9]: made by rd.event; must be rd.state { ... }
-- expect: 28: states[10].unit: a number; must be a text
local rd = require "refdyn"
local p = rd.parameters { { "R", 2, "ohm" } }
local u = rd.input("u", 0, "V")
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  states = function(s)
    return {
      rd.state { rate = u },
      rd.state { "i" },
      rd.state { "j", rate = "u" },
      rd.state { "k", rate = u, start = "0" },
      rd.state { "l", rate = u, begin = 1 },
      rd.state { "m", rate = u, scale = 0 },
      rd.state { "n", rate = u, start = s.t },
      rd.state { "n", rate = p.R },
      rd.event { s.t - 1 },
      rd.state { "o", rate = u, unit = 1 },
    }
  end,
}
