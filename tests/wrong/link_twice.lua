-- expect: 8: link a: the name is already taken in line 6; choose another name
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
    { "b", on = "a", joint = { "x" }, mass = 1 },
    { "a", on = "b", joint = { "x" }, mass = 1 },
  },
}
