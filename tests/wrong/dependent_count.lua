-- expect: 15: dependent: number of coordinates is 2; must be that of constraint rows, 1
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
    { "b", joint = { "y" }, mass = 1 },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.position { s.q.a_x },
    }
  end,
  dependent = { "a_x", "b_y" },
}
