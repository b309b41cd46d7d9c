-- expect: 4: constraints: 2 rows, at most as many as coordinates, 1, can hold
-- expect: 13: constraints[2].name: "row 1" is taken by line 12, each row needs its own
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
