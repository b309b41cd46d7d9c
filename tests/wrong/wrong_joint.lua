-- expect: 9: links[1].joint[2]: "w" is not a joint; use x, y, z, phi, theta or psi
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a",
      joint = {
        "x",
        "w",
      }, mass = 1 },
  },
}
