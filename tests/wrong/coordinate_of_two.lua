-- expect: 7: links[2].coordinate: the link has 2 coordinates; must have exactly one
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "psi", mass = 1, center = { 0.5, 0, 0 } },
    { "fore", on = "arm", joint = "psi, x", coordinate = "knee", mass = 1, center = { 0.5, 0, 0 } },
  },
}
