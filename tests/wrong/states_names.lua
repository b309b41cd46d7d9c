-- expect: 19: state a_x: the name is already taken by a coordinate; choose another name
-- expect: 20: state a_x_d: the name is already taken by the rate of a coordinate; choose another name
-- expect: 21: state R: the name is already taken by a parameter; choose another name
-- expect: 22: state u: the name is already taken by an input; choose another name
-- expect: 23: state t: the name is already taken by the time; choose another name
-- expect: 24: state for: a reserved word of C or C++; choose another name
-- expect: 25: state "two words": not an identifier of C; use a letter, then letters, digits and _
-- expect: 29: courses.power: the name is already taken by a state; choose another name
-- expect: 30: dependent: number of coordinates is 1; must be that of constraint rows, 0
-- expect: 30: dependent[1]: "power" is a state, which no row determines; name a coordinate
local rd = require "refdyn"
local p = rd.parameters { { "R", 2, "ohm" } }
local u = rd.input("u", 0, "V")
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  states = function(s)
    return {
      rd.state { "a_x", rate = u },
      rd.state { "a_x_d", rate = u },
      rd.state { "R", rate = u },
      rd.state { "u", rate = u },
      rd.state { "t", rate = u },
      rd.state { "for", rate = u },
      rd.state { "two words", rate = p.R },
      rd.state { "power", rate = u },
    }
  end,
  courses = function(s) return { power = u } end,
  dependent = { "power" },
}
