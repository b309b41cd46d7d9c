-- expect: 8: courses: the function gives a list, a table of values by name is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  courses = function(s) return { s.t } end,
}
