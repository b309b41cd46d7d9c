-- expect: 6: links[1].joint[1]: "free" is not a joint; use x, y, z, phi, theta or psi
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "free", "x" }, mass = 1 },
  },
}
