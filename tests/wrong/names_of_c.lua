-- expect: 3: model math: math.h is a header of the system; choose another name
local rd = require "refdyn"
return rd.model {
  name = "math", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
}
