-- expect: 4: constraints: number of rows is 2; must be at most that of coordinates, 1
-- expect: 13: constraints[2].name: "row 1" is already taken in line 12; choose another name
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.position { s.q.a_x },
      rd.position { s.points.E.x, name = "row 1" },
    }
  end,
}
