-- expect: 7: links[1]: "a" on "c" on "b" on "a" is a cycle; put one of these links on another link or on the ground
-- expect: 11: links[5]: "e" on "e" is a cycle; put one of these links on another link or on the ground
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
