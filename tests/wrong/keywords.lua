-- expect: 9: link int: a reserved word of C or C++, another name is needed
-- expect: 10: link operator: a reserved word of C or C++, another name is needed
-- expect: 11: link "2nd": no identifier of C, a letter and then letters, digits and _ are needed
-- expect: 13: point double: a reserved word of C or C++, another name is needed
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
