-- expect: 8: forces.a_x: depends on accelerations; a force may depend on t, q, qd and inputs only
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = s.qdd.a_x } end,
}
