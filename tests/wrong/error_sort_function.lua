-- expect: 0: the file returns nothing, return rd.model { ... } is needed
local rd = require "refdyn"
table.sort({ 2, 1 }, math.sinh)
