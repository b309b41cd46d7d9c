-- expect: 9: link int: a reserved word of C or C++; choose another name
-- expect: 10: link operator: a reserved word of C or C++; choose another name
-- expect: 11: link "2nd": not an identifier of C; use a letter, then letters, digits and _
-- expect: 13: point double: a reserved word of C or C++; choose another name
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "int", joint = "x", mass = 1 },
    { "operator", on = "int", joint = "x", mass = 1 },
    { "2nd", on = "int", joint = "x", mass = 1 },
  },
  points = { ["double"] = "int" },
}
