-- expect: 6: option "": not an identifier of C; use a letter, then letters, digits and _
-- expect: 7: parameter "": not an identifier of C; use a letter, then letters, digits and _
-- expect: 8: input "": not an identifier of C; use a letter, then letters, digits and _
-- expect: 15: point "": not an identifier of C; use a letter, then letters, digits and _
local rd = require "refdyn"
rd.option("", 1)
rd.parameter("", 1)
rd.input("")
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  points = { [""] = "arm" },
}
