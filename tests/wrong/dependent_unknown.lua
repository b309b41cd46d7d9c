-- expect: 14: dependent[1]: unknown coordinate "a_y"; did you mean "a_x"?
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
    }
  end,
  dependent = { "a_y" },
  hold = { "a_y" },
}
