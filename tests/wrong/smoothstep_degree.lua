-- expect: 6: rd.smoothstep: argument 4 is a number; must be 3, 5, 7 or 9, as in rd.smoothstep(t, t0, t1)
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  courses = function(s) return { rise = rd.smoothstep(s.t, 2, 3, 4) } end,
}
