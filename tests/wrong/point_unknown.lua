-- expect: 11: s.points.F: unknown point; use E
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.position { s.points.F.x },
    }
  end,
}
