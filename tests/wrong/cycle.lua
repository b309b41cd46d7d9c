-- expect: 7: links[1]: "a" stands on "c" stands on "b" stands on "a", a chain that ends on the ground is needed
-- expect: 11: links[5]: "e" stands on "e", a chain that ends on the ground is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", on = "c", joint = { "x" }, mass = 1 },
    { "b", on = "a", mass = 1 },
    { "c", on = "b", mass = 1 },
    { "d", on = "c", mass = 1 },
    { "e", on = "e", mass = 1 },
  },
}
