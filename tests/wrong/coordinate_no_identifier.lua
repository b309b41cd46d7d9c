-- expect: 7: coordinate "knee-1": not an identifier of C; use a letter, then letters, digits and _
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "psi", mass = 1, center = { 0.5, 0, 0 } },
    { "fore", on = "arm", joint = "psi", coordinate = "knee-1", mass = 1, center = { 0.5, 0, 0 } },
  },
}
