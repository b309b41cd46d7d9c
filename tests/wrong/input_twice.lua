-- expect: 4: input tau: the name is already taken in line 3; choose another name
local rd = require "refdyn"
rd.input("tau", 0)
rd.input("tau", 1)
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
}
