-- expect: 0: the file returns nothing; must return rd.model { ... }
local rd = require "refdyn"
table.sort({ 2, 1 }, math.sinh)
