-- expect: 3: bad argument #2 to 'insert' (position out of bounds)
local rd = require "refdyn"
table.insert({}, 5, 1)
