-- expect: 2: the file returns a table; must return rd.model { ... }
return { name = "wrong" }
